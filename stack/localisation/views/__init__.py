"""Where to drive so that a scan tells rival poses apart."""
