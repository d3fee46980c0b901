# SPDX-License-Identifier: BSD-3-Clause
# Warnings and sanitizers of this project's own targets; nothing here reaches a user of the library.
function(bundle_icp_set_compiler_options target)
  # Vectors are passed between inlined functions only, where the ABI (psabi) does not matter.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wno-unknown-pragmas -Wno-psabi)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    # PCL's macros for point types make structs without a name.
    target_compile_options(${target} PRIVATE -Wno-gnu-anonymous-struct -Wno-nested-anon-types)
  endif()
  if(BUNDLE_ICP_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(BUNDLE_ICP_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${BUNDLE_ICP_SANITIZE} -fno-omit-frame-pointer)
    if(BUNDLE_ICP_SANITIZE MATCHES undefined)
      # Checks of each reference for null and alignment double the time to compile Eigen's templates; the
      # address sanitizer catches access through null, Eigen's assertions misaligned matrices.
      target_compile_options(${target} PRIVATE -fno-sanitize=null,alignment)
    endif()
    if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
      # Loops with a sanitizer's checks in them are no vector loops any more.
      target_compile_options(${target} PRIVATE -Wno-pass-failed)
    endif()
    # Under the address sanitizer Eigen aligns memory by itself, which PCL, built without, would then
    # free, or free of PCL's. The sanitizer's malloc aligns as the system's does.
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
    target_link_options(${target} PRIVATE -fsanitize=${BUNDLE_ICP_SANITIZE})
  endif()
endfunction()
