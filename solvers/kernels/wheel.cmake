# What is installed for others is one package: `solvers` and `coupling` are names that other projects may have too. In a
# wheel they are `fsci.solvers` and `fsci.coupling`, and what imports them says so. `fsci.bench` stays behind: it runs
# cases of the repository.
get_filename_component(root ${CMAKE_SOURCE_DIR}/../.. ABSOLUTE)
file(GLOB_RECURSE modules RELATIVE ${root} ${root}/fsci/*.py ${root}/solvers/*.py ${root}/coupling/*.py)
list(FILTER modules EXCLUDE REGEX "^fsci/bench/")
file(REMOVE_RECURSE ${CMAKE_BINARY_DIR}/wheel) # modules that are no more
foreach(module ${modules})
  file(READ ${root}/${module} text)
  string(REGEX REPLACE "((^|\n) *from )(solvers|coupling)([. ])" "\\1fsci.\\3\\4" text "${text}")
  string(REGEX REPLACE "^(solvers|coupling)/" "fsci/\\1/" module ${module})
  file(WRITE ${CMAKE_BINARY_DIR}/wheel/${module} "${text}")
endforeach()
install(DIRECTORY ${CMAKE_BINARY_DIR}/wheel/fsci DESTINATION .)
install(FILES ${root}/fsci/resolution/table.json DESTINATION fsci/resolution)
install(FILES ${root}/fsci/stress/scenes.yaml ${root}/fsci/stress/cases.yaml DESTINATION fsci/stress)
