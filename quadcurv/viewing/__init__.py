"""Looking at results: maps, figures, windows, pages."""
