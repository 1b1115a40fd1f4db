"""The arm: kinematics, smooth tilts about the pivot, the safety gate, the drivers and the agent that joins them."""
