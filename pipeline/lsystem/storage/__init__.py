"""L-systems on disk: compressed files, and archives of many trees."""
