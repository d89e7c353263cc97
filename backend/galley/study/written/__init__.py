"""What a researcher writes: the study file, questionnaires, texts, and what may be wrong with them."""
