"""What both sides of Repose are built on: messages, topics, the bus, clocks, configuration and geometry."""
