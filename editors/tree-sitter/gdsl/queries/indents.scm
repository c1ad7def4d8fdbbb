[(domain) (entity) (choice) (relation)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
