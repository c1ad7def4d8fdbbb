[(machine) (transitions) (substates)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
