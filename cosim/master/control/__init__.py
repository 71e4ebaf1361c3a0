"""Step control: into which steps the way from one communication point to the next is divided."""
