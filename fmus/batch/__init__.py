"""Many members of one system, stepped by one compiled loop: parameters, inputs, seeds and events differ by member."""
