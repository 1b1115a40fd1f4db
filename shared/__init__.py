"""The base of both sides of Repose: messages, topics, the bus, clocks, configuration and geometry."""
