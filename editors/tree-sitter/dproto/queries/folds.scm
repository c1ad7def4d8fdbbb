[(scalar) (vector) (matrix) (represented) (map) (index) (function) (domain) (prototype)] @fold
(comment) @fold
