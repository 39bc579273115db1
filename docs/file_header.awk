# SPDX-License-Identifier: Apache-2.0
# What Doxygen reads in place of a header, line by line the same: the lines that begin a file and say what it is about become
# the file's documentation, and that of the class that the file is named after, if it has none of its own.
BEGIN {
  name = ARGV[1]
  sub(/.*\//, "", name)
  sub(/\.[a-z]*$/, "", name)
  gsub(/_/, "", name)
}
FNR == 1 && /^\/\/ SPDX/ { print "/// @file"; next }
FNR == 2 && /^\/\/ SPDX/ { print "///"; in_header = 1; next }
in_header && /^\/\/ / { text = text " " substr($0, 4); print "///" substr($0, 3); next }
in_header { in_header = 0 }
!documented && before !~ /^ *\/\/\// && text != "" && match($0, /^(template <.*> *)?(class|struct) [A-Za-z0-9]+( final)? *(:.*)?\{/) {
  class_name = $0
  sub(/^(template <.*> *)?(class|struct) /, "", class_name)
  sub(/[^A-Za-z0-9].*/, "", class_name)
  if (tolower(class_name) == name) {
    documented = 1
    before = $0
    print "/**" text " */ " $0
    next
  }
}
{ before = $0; print }
