"""Arrays of a session for the analyses: no files, no bus, no clock.

Times are int64 nanoseconds on the station's clock, capture times throughout; float64 would lose 200 ns of them.
"""
