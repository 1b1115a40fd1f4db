"""The paper's study in simulation: its four surface pairs, sampled, analysed and put beside what the paper prints."""
