"""Pure compiled functions on arrays. No classes, no input or output, no choice of method: that is the business of the layer above."""
