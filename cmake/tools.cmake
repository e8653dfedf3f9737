# One small main per executable: src/tools/<name>.cpp.
