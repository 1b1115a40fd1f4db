"""Every file here is a family of fuzz targets, found by being here: its `TARGETS` are `tests.fuzz.target.Target`."""
