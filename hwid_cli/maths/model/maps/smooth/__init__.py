"""Values of smooth maps, in an order of arithmetic that other programs can repeat."""
