"""What a delayed measurement needs: a memory of the recent past, and the prediction over the delay."""
