"""The kinds of stage: what each says in a study file, becomes in a visit, takes in time, and is told as."""
