"""Plans of drives: requests beside the loop, queries, choice of the better one, blocked routes."""
