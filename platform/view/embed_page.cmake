# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# cmake -DPAGE=folder -DFILES=a,b -DOUT=page_files.cpp -P embed_page.cmake: the files as constants. The same files give
# the same bytes.
string(REPLACE "," ";" files "${FILES}")
list(SORT files)
set(types_html "text/html; charset=utf-8")
set(types_css "text/css; charset=utf-8")
set(types_js "text/javascript; charset=utf-8")
set(types_svg "image/svg+xml")
set(constants "")
set(entries "")
set(number 0)
foreach(name IN LISTS files)
  file(READ "${PAGE}/${name}" bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  string(REGEX REPLACE "\\.([a-z]+)$" ";\\1" parts "${name}")
  list(GET parts 1 extension)
  string(APPEND constants "constexpr unsigned char kFile${number}[] = {${bytes}};\n")
  string(APPEND entries "    {\"${name}\", \"${types_${extension}}\", std::as_bytes(std::span(kFile${number}))},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE "${OUT}" "#include \"view/page_files.hpp\"\n\nnamespace tessera {\n\nnamespace {\n\n${constants}\n"
  "const PageFile kFiles[] = {\n${entries}};\n\n}  // namespace\n\n"
  "std::span<const PageFile> page_files() noexcept { return kFiles; }\n\n}  // namespace tessera\n")
