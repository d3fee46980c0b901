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
    -D CMAKE_PREFIX_PATH=${prefix} -D CMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON ${ARGN})
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

# Options that change the layout of Eigen's matrices, the language and the standard library.
if(EXISTS /proc/cpuinfo)
  file(STRINGS /proc/cpuinfo cpu_features REGEX "^flags" LIMIT_COUNT 1)
endif()
set(other_options "-std=c++20 -D_GLIBCXX_ASSERTIONS")
if(processor STREQUAL x86_64 AND cpu_features MATCHES " avx2 ")
  string(APPEND other_options " -mavx2")
endif()
build_project(${work_folder}/consumer ${work_folder}/other_consumer_build
  "-DCMAKE_CXX_FLAGS=${other_options}")
run(${work_folder}/other_consumer_build/consumer)

# Another compiler than the library's, where there is one.
find_program(clang NAMES clang++ clang++-19 clang++-18 clang++-17 clang++-16 clang++-15 clang++-14)
if(clang AND NOT clang STREQUAL compiler)
  build_project(${work_folder}/consumer ${work_folder}/clang_consumer_build
    -D CMAKE_CXX_COMPILER=${clang})
  run(${work_folder}/clang_consumer_build/consumer)
else()
  message(STATUS "no other compiler, clang++: its consumer is skipped")
endif()

# An application whose numbers have decimal commas.
file(COPY ${source_folder}/test/install/locale DESTINATION ${work_folder})
build_project(${work_folder}/locale ${work_folder}/locale_build)
run(${CMAKE_COMMAND} -E chdir ${work_folder} ${work_folder}/locale_build/locale)
message(STATUS "${output}")

# By pkg-config, and without what the library needs of a compiler: a refusal, not a wrong result.
find_program(pkg_config pkg-config)
if(pkg_config AND EXISTS ${prefix}/${library_folder}/pkgconfig/bundle_icp.pc)
  set(ENV{PKG_CONFIG_PATH} ${prefix}/${library_folder}/pkgconfig)
  run(${pkg_config} --cflags bundle_icp)
  separate_arguments(flags UNIX_COMMAND "${output}")
  file(WRITE ${work_folder}/header.cpp "#include <bundle_icp/common/pose.h>\n")
  run(${compiler} -std=c++17 -fsyntax-only ${flags} ${work_folder}/header.cpp)
  list(REMOVE_ITEM flags "-DEIGEN_MAX_ALIGN_BYTES=${eigen_alignment}")
  execute_process(COMMAND ${compiler} -std=c++17 -fsyntax-only ${flags} -DEIGEN_MAX_ALIGN_BYTES=64
    ${work_folder}/header.cpp RESULT_VARIABLE result ERROR_VARIABLE errors OUTPUT_QUIET)
  if(result EQUAL 0 OR NOT errors MATCHES "compile with -DEIGEN_MAX_ALIGN_BYTES=${eigen_alignment}")
    message(FATAL_ERROR "another alignment of Eigen is not refused:\n${errors}")
  endif()
endif()

file(GLOB_RECURSE headers RELATIVE ${prefix}/include ${prefix}/include/*.h)
set(includes "")
foreach(header IN LISTS headers)
  string(APPEND includes "#include <${header}>\n")
endforeach()
file(WRITE ${work_folder}/headers/headers.h "${includes}")
file(COPY ${source_folder}/test/install/headers/ DESTINATION ${work_folder}/headers)
build_project(${work_folder}/headers ${work_folder}/headers_build)
run(${work_folder}/headers_build/headers)

# As a part of another project it changes none of that project's settings.
file(WRITE ${work_folder}/parent/CMakeLists.txt "
cmake_minimum_required(VERSION 3.16)
project(parent LANGUAGES C CXX)
add_subdirectory(${source_folder} bundle_icp)
if(DEFINED CACHE{BUILD_SHARED_LIBS} OR CMAKE_BUILD_TYPE)
  message(FATAL_ERROR \"settings of the parent have changed\")
endif()
if(NOT TARGET bundle_icp::bundle_icp OR TARGET bundle_icp_reconstruct)
  message(FATAL_ERROR \"expected the library alone\")
endif()
")
run(${CMAKE_COMMAND} -S ${work_folder}/parent -B ${work_folder}/parent_build -G ${generator}
  -D CMAKE_CXX_COMPILER=${compiler})

# Uninstalling removes what was installed: here from the place before it was moved.
file(RENAME ${prefix} ${work_folder}/installed)
run(${CMAKE_COMMAND} -D manifest=${build_folder}/install_manifest.txt -P ${source_folder}/cmake/uninstall.cmake)
file(GLOB_RECURSE left ${work_folder}/installed/*)
if(left)
  message(FATAL_ERROR "uninstalling left ${left}")
endif()
