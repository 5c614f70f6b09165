# Debian packages: cpack -G DEB makes shakebed (the program), libshakebed-dev and python3-shakebed. packaging/build_deb.sh
# configures the build they are made from.
set(CPACK_PACKAGE_NAME shakebed)
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGE_CONTACT "the authors of shakebed <shakebed@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENTS_ALL program development)

# The same shared libraries for processors with AVX2 and FMA, from a build of their own: packaging/build_deb.sh.
set(SHAKEBED_FAST_BUILD "" CACHE PATH "Build folder of the shared libraries for x86-64-v3, which the loader prefers")
if(SHAKEBED_FAST_BUILD)
  foreach(room statistics sim ingest fit)
    install(FILES "${SHAKEBED_FAST_BUILD}/${room}/libshakebed_${room}.so.${PROJECT_VERSION}"
            DESTINATION "${CMAKE_INSTALL_LIBDIR}/glibc-hwcaps/x86-64-v3" COMPONENT program
            RENAME "libshakebed_${room}.so.${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
  endforeach()
endif()
foreach(room statistics sim ingest fit)
  list(APPEND CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/${room}")
endforeach()

# Debian wants the licence of each package in share/doc/<package>.
function(shakebed_copyright component package)
  install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/${package}" RENAME copyright
          COMPONENT ${component})
endfunction()
shakebed_copyright(program shakebed)
shakebed_copyright(development libshakebed-dev)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME shakebed)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "gnuplot-nox")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The program, its images module, recipes, manual pages and completions.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libshakebed-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "libgsl-dev, libopencv-videoio-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
    "Libraries and headers of shakebed::sim (standard library only), shakebed::fit (needs libgsl-dev) and\n shakebed::ingest (needs libopencv-videoio-dev), with files for CMake and pkg-config.")

if(TARGET shakebed_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  shakebed_copyright(python python3-shakebed)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-shakebed)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "shakebed (= ${PROJECT_VERSION}), python3-numpy, python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3 (<< ${Python3_VERSION_MAJOR}.${next_minor})")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-matplotlib")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "The Python module shakebed.")
endif()
include(CPack)
