"""What it means: teams evaluated on kitchens by the measures of their trials."""
