[(scalar) (vector) (matrix) (represented) (map) (index) (function) (domain) (prototype)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
