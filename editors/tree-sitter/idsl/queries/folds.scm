[(module) (enum_decl) (struct_decl) (exception_decl) (interface_decl)] @fold
(comment) @fold
