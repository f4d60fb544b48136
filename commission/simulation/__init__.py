"""A virtual vehicle in a virtual hall: it drives, slips, scans and meets people, and reports what a real one would."""
