[(machine) (transitions) (substates)] @fold
(comment) @fold
