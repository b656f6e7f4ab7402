"""A measured comparison as tables, Markdown, CSV, JSON and a figure."""
