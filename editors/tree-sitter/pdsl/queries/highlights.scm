(comment) @comment
["and" "componentparams" "element" "f" "false" "group" "h" "import" "list" "min" "ms" "not" "of" "or" "reads" "require" "restart" "s" "secret" "t" "true" "unit" "us"] @keyword
(params "componentparams" . (name) @type)
(list "list" . (name) @type)
(group "group" . (name) @type)
(string) @string
(number) @number
(duration) @number
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["!" "!=" "&&" "*" "+" "," "-" "." "/" ":" ";" "<" "<=" "=" "==" ">" ">=" "||"] @punctuation.delimiter
