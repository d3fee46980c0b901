# SPDX-License-Identifier: BSD-3-Clause
include(CheckCXXSourceCompiles)

# Sets a variable to the value of EIGEN_MAX_ALIGN_BYTES with which PCL was built: that of the options which
# PCL's targets carry, and of no others.
function(bundle_icp_find_eigen_alignment variable)
  set(CMAKE_CXX_FLAGS "")
  set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen pcl_common)
  set(CMAKE_REQUIRED_QUIET ON)
  foreach(bytes IN ITEMS 16 32 64 0)
    check_cxx_source_compiles("
      #include <Eigen/Core>
      #if EIGEN_MAX_ALIGN_BYTES != ${bytes}
      #error
      #endif
      int main() {}" BUNDLE_ICP_EIGEN_ALIGNS_${bytes})
    if(BUNDLE_ICP_EIGEN_ALIGNS_${bytes})
      set(${variable} ${bytes} PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "bundle_icp: how Eigen aligns cannot be found out; does Eigen compile?")
endfunction()
