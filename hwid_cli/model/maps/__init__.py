"""The kinds of static map: one module each, of the name in `records.maps.MAP_KINDS`."""
