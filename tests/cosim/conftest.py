"""Makes the helpers of this folder importable for the tests in its rooms; pytest puts the folder of a conftest on the path."""
