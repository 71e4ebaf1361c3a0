"""What all pictures share: colours, dashes, fonts and the canvas."""
