"""Generator of worlds: flats, offices, warehouses, hotel corridors, and a featureless corridor."""
