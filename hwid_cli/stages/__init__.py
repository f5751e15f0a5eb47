"""The stages of an experiment: what each needs, computes, stores and shows."""
