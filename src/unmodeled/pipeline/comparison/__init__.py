"""Where a fitted model fails: residuals, their structure, and the force that would explain them."""
