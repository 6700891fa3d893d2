"""What is known of one simplex: predicates, measures, objectives."""
