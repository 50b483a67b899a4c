"""Motion made by code: a licence-free set of standing, walking, turning and sitting clips."""
