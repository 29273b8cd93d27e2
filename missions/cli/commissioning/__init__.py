"""`treepilot preflight`: checks of a robot before it drives."""
