# SPDX-License-Identifier: BSD-3-Clause
# Installs the build to a prefix, moves the prefix, builds examples/consumer and a program that
# includes every public header against it, and looks at what came out.
cmake_minimum_required(VERSION 3.16)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\nended with ${result}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# Nothing may remember where it was built, or it works on this machine only.
function(check_places what text)
  foreach(place IN ITEMS ${build_folder} ${source_folder} ${work_folder})
    string(FIND "${text}" "${place}" position)
    if(NOT position EQUAL -1)
      message(FATAL_ERROR "${what} mentions ${place}:\n${text}")
    endif()
  endforeach()
endfunction()

# Neither linked nor loaded: OpenCV's core, which all use, shows that the list is one.
function(check_no_vtk file)
  run(ldd ${file})
  if(output MATCHES "libvtk" OR NOT output MATCHES "libopencv_core")
    message(FATAL_ERROR "${file} loads VTK, or cannot be loaded:\n${output}")
  endif()
endfunction()

function(build_project source build)
  run(${CMAKE_COMMAND} -S ${source} -B ${build} -G ${generator}
    -D CMAKE_BUILD_TYPE=Release -D CMAKE_CXX_COMPILER=${compiler}
    -D CMAKE_PREFIX_PATH=${prefix} -D CMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON)
  run(${CMAKE_COMMAND} --build ${build})
endfunction()

file(REMOVE_RECURSE ${work_folder})
file(MAKE_DIRECTORY ${work_folder})
run(${CMAKE_COMMAND} --install ${build_folder} --prefix ${work_folder}/installed)
set(prefix ${work_folder}/moved)
file(RENAME ${work_folder}/installed ${prefix})

file(GLOB_RECURSE package_files ${prefix}/${library_folder}/cmake/*.cmake)
foreach(file IN LISTS package_files)
  file(READ ${file} text)
  check_places(${file} "${text}")
endforeach()
file(GLOB binaries ${prefix}/bin/* ${prefix}/${library_folder}/*.so)
foreach(file IN LISTS binaries)
  run(${readelf} -d ${file})
  string(REGEX MATCHALL "R[UN]*PATH[^\n]*" paths "${output}")
  check_places(${file} "${paths}")
  check_no_vtk(${file})
endforeach()
file(GLOB programs ${prefix}/bin/bundle_icp_*)
foreach(program IN LISTS programs)
  run(${program} -h)
endforeach()

# Copied, so that no relative path leads back to the sources.
file(COPY ${source_folder}/examples/consumer DESTINATION ${work_folder})
build_project(${work_folder}/consumer ${work_folder}/consumer_build)
run(${work_folder}/consumer_build/consumer)
check_no_vtk(${work_folder}/consumer_build/consumer)

file(GLOB_RECURSE headers RELATIVE ${prefix}/include ${prefix}/include/*.h)
set(includes "")
foreach(header IN LISTS headers)
  string(APPEND includes "#include <${header}>\n")
endforeach()
file(WRITE ${work_folder}/headers/headers.h "${includes}")
file(COPY ${source_folder}/test/install/headers/ DESTINATION ${work_folder}/headers)
build_project(${work_folder}/headers ${work_folder}/headers_build)
run(${work_folder}/headers_build/headers)
