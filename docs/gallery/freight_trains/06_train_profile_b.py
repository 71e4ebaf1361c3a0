"""Four observers beside the locomotive on profile B: the other consistent reading of the printed protocol, 50 m/s and 3
km.
"""

from __future__ import annotations

from train_profile import compare

if __name__ == "__main__":
    compare(__file__, "freight_profile_b", "Train on profile B: 50 m/s, 3 km")
