"""Published competitors of the micrograin model, for comparison: rough metal with pores, by other microgeometries."""
