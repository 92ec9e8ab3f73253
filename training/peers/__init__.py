"""What people would use instead of bouncelight, drawn and judged beside it: `python -m peers --help`."""
