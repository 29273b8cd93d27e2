"""What makes one rollout better than another."""
