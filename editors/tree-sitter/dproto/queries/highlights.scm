(comment) @comment
["Matrix" "Scalar" "Vector" "algebraic" "alias" "axes" "conversion" "ddr" "domain" "dproto" "fproto" "import" "load" "member" "units" "view"] @keyword
(axes "axes" . (name) @type)
(algebraic "algebraic" . (name) @type)
(ddr "ddr" . (name) @type)
(units "units" . (name) @type)
(alias "alias" . (name) @type)
(view "view" . (name) @type)
(conversion "conversion" . (name) @type)
(function "fproto" . (name) @type)
(domain "domain" . (name) @type)
(prototype "dproto" . (name) @type)
(string) @string
["{" "}"] @punctuation.bracket
["," "-" "->" "." "::" ";" "<->" "<=" "=" "=>"] @punctuation.delimiter
