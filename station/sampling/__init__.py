"""The paper's acquisition (sections III and IV) as a pure state machine: messages in, actions out, no clock, no I/O."""
