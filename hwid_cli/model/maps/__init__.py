"""The kinds of static map, one module each; `static_map.RULES` lists them."""
