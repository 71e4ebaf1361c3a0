"""Four observers beside the locomotive on profile D: Figures 3.9 to 3.16 and 3.18 to 3.23, the maximal speed errors."""

from __future__ import annotations

from train_profile import compare

if __name__ == "__main__":
    compare(__file__, "freight_profile_d", "Train on profile D: 50 km/h, 0.9 km")
