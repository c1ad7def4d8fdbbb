[(module) (enum_decl) (struct_decl) (exception_decl) (interface_decl)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
