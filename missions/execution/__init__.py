"""Mission execution: prepare (read and check), build (connect the parts), run, report, reload."""
