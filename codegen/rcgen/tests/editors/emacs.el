;; The client of rcgen for Emacs 28 or newer: Eglot is part of Emacs 29, and a package before.
(define-derived-mode robocomp-mode prog-mode "RoboComp"
  (setq-local comment-start "// "))
(add-to-list 'auto-mode-alist '("\\.\\(idsl\\|cdsl\\|pdsl\\|smdsl\\|ddsl\\|gdsl\\|dproto\\|kdsl\\|ilk\\)\\'" . robocomp-mode))
(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs '(robocomp-mode . ("rcgen" "lsp"))))
(add-hook 'robocomp-mode-hook #'eglot-ensure)
