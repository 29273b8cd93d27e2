"""World files: what stands in a simulated place, read and checked. Data only."""
