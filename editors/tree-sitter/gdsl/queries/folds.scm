[(domain) (entity) (choice) (relation)] @fold
(comment) @fold
