[(params) (list) (group) (choice)] @fold
(comment) @fold
