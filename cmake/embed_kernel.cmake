# Writes OUTPUT, a .cpp that defines `const char* <STEM>KernelSource()` with the text of INPUT.
file(READ ${INPUT} text)
# Compilers limit the length of one literal; adjacent raw literals are joined.
string(LENGTH "${text}" length)
set(literals "")
set(position 0)
while(position LESS length)
  string(SUBSTRING "${text}" ${position} 8000 part)
  string(APPEND literals "R\"kernel(${part})kernel\"\n")
  math(EXPR position "${position} + 8000")
endwhile()
file(WRITE ${OUTPUT}
  "namespace xray_registration {\nnamespace kernels {\nextern const char* const ${STEM};\nconst char* const ${STEM} =\n${literals};\n}\n}\n")
