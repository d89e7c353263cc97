"""What should happen in a study: its file, its questionnaires, a plan for each visit, progress through it."""
