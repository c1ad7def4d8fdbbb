(comment) @comment
["command" "const" "dictionary" "enum" "exception" "extends" "h" "idempotent" "import" "interface" "min" "module" "ms" "out" "publish" "query" "s" "sequence" "string" "struct" "throws" "us"] @keyword
(module "module" . (name) @type)
(enum_decl "enum" . (name) @type)
(struct_decl "struct" . (name) @type)
(exception_decl "exception" . (name) @type)
(interface_decl "interface" . (name) @type)
(string) @string
(number) @number
(duration) @number
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["," "::" ";" "<" "=" ">" "@"] @punctuation.delimiter
