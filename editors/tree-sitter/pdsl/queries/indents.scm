[(params) (list) (group) (choice)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
