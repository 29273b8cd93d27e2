"""Critics of the MPPI controller: costs of the rollouts."""
