"""Step 1: bubbles packed tightly in the target region by the packing metric, following its boundary."""
