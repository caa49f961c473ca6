"""Pure compiled functions on arrays: no classes, no input or output. Which one to call is the business of the layer above."""
